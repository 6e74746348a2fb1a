"""Lower bounds on the UGV's cost, over cells of leg angles, not only over a grid."""
