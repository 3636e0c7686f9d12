"""TachoBot's loop at rising rates: what is late, and where a tick's time goes."""
