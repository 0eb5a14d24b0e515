"""What questions share: their base class, options and scenes."""
