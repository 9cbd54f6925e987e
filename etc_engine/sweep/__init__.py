"""Sweeps of random realizations: study file, plan, scheduler, shards, statistics, dataset."""
