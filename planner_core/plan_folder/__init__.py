"""The plan folder: plan.json, the USD stage, clouds, lists, maps and the report; written, read and opened."""
