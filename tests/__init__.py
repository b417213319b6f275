"""The tests, what helps them (helpers), the benchmark and the documentation's tables.

All is imported by full names, such as tests.helpers.scenes, from the repository's folder.
"""
