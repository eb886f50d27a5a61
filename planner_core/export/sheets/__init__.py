"""Sheets for people: a plan as pages to print, and as one page for browsers. PlanSource -> PDF, HTML."""
