"""The axis controllers of the APO 3.5 m and the SDSS 2.5 m telescopes, commanded by paths of nodes."""
