"""Networks and support vector machines with multivectors."""
