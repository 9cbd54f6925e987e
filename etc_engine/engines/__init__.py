"""Engines: each turns a medium and a load into heat flows; none imports another."""
