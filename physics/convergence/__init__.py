"""Grid convergence: the limit of vanishing mesh size and its uncertainty, from three meshes or more.

Another estimator of the discretisation error goes here, beside `grid` (three meshes) and `least_squares`
(more).
"""
