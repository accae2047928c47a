"""Reports: a page of a run or a study with its pictures, plots and tables, in one file."""
