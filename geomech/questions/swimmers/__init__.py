"""Questions about swimmers: connections, displacements, forces and gaits."""
