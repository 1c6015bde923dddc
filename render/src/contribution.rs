//! How much each Gaussian shows in a set of views.
