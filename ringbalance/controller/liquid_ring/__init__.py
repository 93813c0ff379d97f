"""The liquid ring as a balancer, and what its liquid can do at best."""
