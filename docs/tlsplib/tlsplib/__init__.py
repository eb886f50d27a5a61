"""TLSPLIB: problems of scan planning with proven answers; docs/tlsplib/index.md says what they are for."""
