"""The methods raced by name: functions of an objective and a seed, ended by the budget."""
