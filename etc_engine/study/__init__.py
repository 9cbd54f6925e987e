"""Study files: tables, their words, what they allow, and the identity of a study."""
