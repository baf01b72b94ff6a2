"""What a live session shows: a page for a browser, or nothing."""
