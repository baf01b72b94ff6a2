"""The report page of a run: figures, plots and pictures. Needs the extra `report`."""
