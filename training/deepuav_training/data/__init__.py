"""Images, homographies, degradations and the cache of teacher labels."""
