"""What `check --fix` changes in a recording: delays of films and directions of cameras that are certain."""
