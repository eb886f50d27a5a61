"""The method paper (López et al. 2023), whole: its metrics, spatial search, genetic selection and overlap repair."""
