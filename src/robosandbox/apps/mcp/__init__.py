"""The skills as tools for clients that speak the Model Context Protocol."""
