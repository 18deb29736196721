"""The axis controllers of the APO 3.5 m and the SDSS telescopes: what a configuration means for them."""
