"""The liquid ring as a balancer, and the largest correction of its liquid."""
