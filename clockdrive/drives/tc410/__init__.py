"""The TC410: what a configuration means for it."""
