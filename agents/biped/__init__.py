"""The biped as a machine to train and compare: task, baselines, configuration, pictures."""
