"""City model to CityJSON 2.0 and back."""
