"""TLSPLIB: problems of scan planning with proven answers; docs/tlsplib/index.md describes their purpose."""
