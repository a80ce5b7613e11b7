"""The program on the command line: its commands by purpose, their examples, answers to wrong lines."""
