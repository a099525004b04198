"""What people look at: the paper's figures, drawn from records."""
