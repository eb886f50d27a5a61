"""What positions see, how well, and why the rest stays unseen."""
