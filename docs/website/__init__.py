"""Build the documentation site from the pages of the repository and from pages generated from the code."""
