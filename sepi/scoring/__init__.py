"""What scores need: masks of regions, and the submission format of the HCI 4D benchmark."""
