"""Sheets to print: a PDF of the plan, page by page, and the same as HTML."""
