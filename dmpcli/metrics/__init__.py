"""Wave height, deviation, smoothness and timing of strokes: arrays in, numbers out."""
