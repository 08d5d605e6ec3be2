"""Players: a bag over real topics, by the clock of the machine or by /clock."""
