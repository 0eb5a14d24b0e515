"""The balance of forces: one formula of a Newton step, and two drivers that apply it
(`rft.balance.velocity`)."""
