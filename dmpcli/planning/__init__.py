"""From trajectories to checked set-points: arrays alone, no clock and no instrument."""
