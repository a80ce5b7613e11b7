"""The spectrum of the torque noise, the filters that whiten it, and the rows that are masked."""
