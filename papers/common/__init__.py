"""What the experiments of both papers share: what is asked, many runs, pictures and tables, claims that are judged, the command line."""
