"""What a live session shows: a window, a page for a browser, or nothing."""
