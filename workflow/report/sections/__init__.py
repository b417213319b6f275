"""The sections of a report, each a function from the data to what it shows.

The table of contents, contents.py beside this folder, names them all.
"""
