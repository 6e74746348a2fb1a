"""`stickslip simulate`: a walk under a torque, or a drive with given leg angles."""
