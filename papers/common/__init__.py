"""Shared by the experiments of both papers: requests, parallel runs, pictures and tables, claims, the command line."""
