"""Ways in which a log is spoilt on its way from the controller, and the formats it is written in."""
