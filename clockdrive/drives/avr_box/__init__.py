"""The AVR stepper box as the application sees it."""
