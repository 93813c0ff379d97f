"""One number by finite elements in two and three dimensions and by quadrature."""
