"""plan.json as one model, which docs/formats/plan.schema.json is made of: what a plan is made from, what came of it."""
