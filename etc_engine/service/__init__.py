"""The service: studies and single solves over HTTP, for people who share one machine or a cluster's login node.

It adds no numerics: a study runs as ``etc-engine sweep ... --resume``, a single solve as ``etc-engine solve``. Nothing
in the engine imports this room; the server needs the extra ``service``, the client (:mod:`etc_engine.service.client`)
needs nothing more than the engine.
"""
