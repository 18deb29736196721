"""The AVR stepper box: a microcontroller that turns two stepper motors, with tracking that cannot be switched off."""
