"""Scene files that come with the program; `ringbalance.scene.bundled_scene` finds them by name."""
