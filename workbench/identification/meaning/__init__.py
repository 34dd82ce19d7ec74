"""What a stranger's rows mean: one search over readings, asked at every entrance."""
