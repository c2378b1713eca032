"""Mutation testing of the safety code: changes the code of the folders below one place at a time and runs the Unity
suites on each changed copy. A change that no suite notices is a survivor.
"""
