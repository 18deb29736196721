"""What the software promises in numbers, measured: `python -m benchmarks` from the checkout.

A benchmark is one function with the decorator `benchmark`, in any module of this package.
"""
