"""Sparse Cholesky factorisations behind the interface of `fras_sim.fem.linear_solver`."""
