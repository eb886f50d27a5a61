"""The review: what people change in a plan while they look at it, kept in `review.usda`. Begin with `changes`."""
