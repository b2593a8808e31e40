"""Training of the networks of Deep-UAV SLAM: SuperPoint in two sizes, and SuperGlue."""
