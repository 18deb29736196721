"""Run by hand, from the checkout: what makes committed data and pages."""
