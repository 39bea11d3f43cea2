"""The builder of the documentation site: pages of the repository, and pages written from the code itself."""
