"""City model to CityGML and back."""
