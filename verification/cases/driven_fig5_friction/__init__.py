"""Fig. 5 of the driven-mass paper: friction estimated while both masses go round."""
