"""The geometry of locomotion: gaits, systems, connections and methods of prediction."""
