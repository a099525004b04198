"""What stands for hardware: the mock lab, the served lab, and the hand that draws in both."""
