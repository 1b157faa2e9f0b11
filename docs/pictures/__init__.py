"""The drawings of these pages, made by the package itself: ``python docs/make_pictures.py docs/_made``."""
