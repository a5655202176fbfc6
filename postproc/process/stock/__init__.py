"""What a program cuts of its blank, and with which force."""
