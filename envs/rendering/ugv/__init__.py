"""Pictures of the UGV."""
