"""Watches the cameras: which are late or early, frozen or blind, and which one contradicts the others in a frame."""
