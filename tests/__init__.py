"""The tests, what they share, the benchmark and the documentation's tables.

All is imported by full names, such as tests.fix.scenes, from the repository's folder.
"""
