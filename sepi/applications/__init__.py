"""What is made of a light field and its finished map: pictures focused after the fact."""
